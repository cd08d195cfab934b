from collections.abc import Callable

from simulator.config import load_camera as load_camera
from simulator.config import load_shot as load_shot
from simulator.config import load_sweep as load_sweep
from simulator.config import schema as schema
from simulator.config import shot_warnings as shot_warnings
from simulator.development import develop as develop
from simulator.errors import PhotositeError as PhotositeError
from simulator.frame import Raw as Raw
from simulator.pipeline import simulate as simulate
from simulator.raw.save import save as save
from simulator.resimulation import resimulate as resimulate
from simulator.shot import Shot as Shot

__version__: str

def homes_of(file: str) -> dict[str, str]: ...
def lazy_names(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]: ...
