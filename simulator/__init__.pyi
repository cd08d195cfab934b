from collections.abc import Callable

from simulator.config import frame_warnings as frame_warnings
from simulator.config import load_camera as load_camera
from simulator.config import load_shot as load_shot
from simulator.config import load_sweep as load_sweep
from simulator.config import schema as schema
from simulator.config import shot_warnings as shot_warnings
from simulator.errors import PhotositeError as PhotositeError
from simulator.pipeline.shot import Shot as Shot
from simulator.pipeline.simulate import simulate as simulate
from simulator.pipeline.simulate import simulate_many as simulate_many
from simulator.raw.development import develop as develop
from simulator.raw.raw_image import Raw as Raw
from simulator.raw.save import save as save
from simulator.studies.resimulation import resimulate as resimulate

__version__: str

def homes_of(file: str) -> dict[str, str]: ...
def lazy_names(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]: ...
