"""The one exception a user may meet: its message is complete and needs no traceback."""


class PhotositeError(Exception):
    """Something the user can put right; the message names what, where, the value and the fix."""


def require(condition: bool, key: str, value: object, rule: str) -> None:
    """Raise PhotositeError `key: value ...: rule` unless the condition holds."""
    if not condition:
        raise PhotositeError(f"{key} = {value}: {rule}")
