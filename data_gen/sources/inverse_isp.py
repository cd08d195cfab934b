"""The way back from a finished sRGB picture to camera signal ("unprocessing"), step by step.

Source: T. Brooks, B. Mildenhall, T. Xue, J. Chen, D. Sharlet, J. T. Barron, "Unprocessing Images for Learned Raw Denoising",
CVPR 2019, section 3, and the numbers of its release (google-research/unprocessing@0c1bbe5). Undone are, in this order, the tone
curve, the gamma, the colour matrix, and the gains of white balance and brightness.
"""

import numpy as np

from simulator.color.camera_matrices import CONNECTION_SPACE_WHITE, forward_matrix
from simulator.color.colour_science import colour_science
from simulator.color.reproducible import nine_digits_each, ordered_product, weighted_sum
from simulator.sensor.camera.camera import Camera

# XYZ to camera of the Darmstadt Noise Dataset's four, as the release has them: Nexus 6P, Sony A7R, Olympus E-M10, RX100 IV.
XYZ_TO_CAMERA = np.array(
    [
        [[1.0234, -0.2969, -0.2266], [-0.5625, 1.6328, -0.0469], [-0.0703, 0.2188, 0.6406]],
        [[0.4913, -0.0541, -0.0202], [-0.6130, 1.3513, 0.2906], [-0.1564, 0.2151, 0.7183]],
        [[0.8380, -0.2630, -0.0639], [-0.2887, 1.0725, 0.2496], [-0.0627, 0.1427, 0.5438]],
        [[0.6596, -0.2079, -0.0562], [-0.4782, 1.3016, 0.1933], [-0.0970, 0.1581, 0.5181]],
    ]
)
# Linear sRGB to XYZ: primaries of IEC 61966-2-1, white (0.95047, 1, 1.08883), D65 as ASTM E308 has it.
SRGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
XYZ_TO_SRGB = nine_digits_each(np.linalg.inv(SRGB_TO_XYZ))
GAMMA = 2.2
RED_GAIN, BLUE_GAIN = (1.9, 2.4), (1.5, 1.9)  # uniform between these
BRIGHTNESS = (0.8, 0.1)  # mean and standard deviation of a normal number: signal over that of the finished picture
INFLECTION = 0.9  # mean of R, G, B above which the gains fade, so that white stays white


def inverse_smoothstep(picture: np.ndarray) -> np.ndarray:
    """Undo the tone curve y = 3 x^2 - 2 x^3, from 0 to 1: x = 1/2 - sin(asin(1 - 2 y) / 3)."""
    return 0.5 - np.sin(np.arcsin(1.0 - 2.0 * np.clip(picture, 0.0, 1.0)) / 3.0)


def expand_gamma(picture: np.ndarray) -> np.ndarray:
    """Undo the gamma of the paper: max(y, 1e-8)^2.2."""
    return np.maximum(picture, 1e-8) ** GAMMA


def mix_matrix(rng: np.random.Generator) -> np.ndarray:
    """Draw a matrix XYZ to camera, (3, 3): a convex mixture of the four, with uniform weights divided by their sum."""
    weights = rng.random(len(XYZ_TO_CAMERA))
    return weighted_sum(XYZ_TO_CAMERA, weights / weights.sum())


def draw_white(rng: np.random.Generator) -> np.ndarray:
    """Draw the camera signal of white, (3,): one over the gains of red and blue, green = 1."""
    return np.array([1.0 / rng.uniform(*RED_GAIN), 1.0, 1.0 / rng.uniform(*BLUE_GAIN)])


def draw_brightness(rng: np.random.Generator) -> float:
    """Draw the brightness of the camera signal relative to the finished picture."""
    return float(np.clip(rng.normal(*BRIGHTNESS), 0.3, 1.3))  # five deviations: no picture becomes black or negative


def to_balanced_camera(xyz_to_camera: np.ndarray) -> np.ndarray:
    """Linear sRGB to white-balanced camera, (3, 3): rows of XYZ-to-camera times sRGB-to-XYZ, each divided by its sum."""
    matrix = ordered_product(xyz_to_camera, SRGB_TO_XYZ)
    return matrix / matrix.sum(axis=1, keepdims=True)


def to_balanced_camera_in(camera: Camera, light: str) -> np.ndarray:
    """Linear sRGB to this camera's colours in a light, white-balanced, (3, 3), to nine digits.

    The inverse of what a raw converter does with the ForwardMatrix for this light (DNG 1.4, chapter 6): sRGB to XYZ under D65,
    Bradford adaptation to D50, and from there to the camera.
    """
    white = SRGB_TO_XYZ.sum(axis=1)
    adapt = colour_science().adaptation.matrix_chromatic_adaptation_VonKries(white, CONNECTION_SPACE_WHITE, "Bradford")
    to_xyz_d50 = forward_matrix(camera.response.wavelengths_nm, camera.response.quantum_efficiency, light)
    return nine_digits_each(np.linalg.solve(to_xyz_d50, adapt @ SRGB_TO_XYZ))


def inverse_gain(mean: np.ndarray, gain: float) -> np.ndarray:
    """Return the factors that undo a gain of white balance and brightness, except where colours are saturated.

    mean: of R, G and B of each pixel, white-balanced. gain: camera signal of white in one colour, usually below 1.
    a = ((mean - 0.9) / 0.1)^2 above a mean of 0.9, else 0; the factor is max(a + (1 - a) gain, gain): 1 for white (equation 5
    of the paper, over the mean of the channels as in its release).
    """
    gain = mean.dtype.type(gain)
    fade = np.square(np.maximum(mean - mean.dtype.type(INFLECTION), 0) / mean.dtype.type(1 - INFLECTION))
    return np.maximum(fade + (1 - fade) * gain, gain)
