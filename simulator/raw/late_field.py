"""Fields of a frozen dataclass that are computed when they are first read; set on the class after it was made."""

from typing import Any


class LateField:
    """Field of a dataclass that holds a value, or a function that makes it, which is called once, when the field is read.

    Its value lies in the object's dictionary under the field's name. The function is let go with what it holds.
    """

    def __init__(self, name: str) -> None:
        """name: of the field."""
        self._name = name

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        if instance is None:
            raise AttributeError(f"{self._name} is a field of an object, not of its class")
        value = instance.__dict__[self._name]
        if callable(value):
            value = instance.__dict__[self._name] = value()
        return value

    def __set__(self, instance: object, value: Any) -> None:
        instance.__dict__[self._name] = value
