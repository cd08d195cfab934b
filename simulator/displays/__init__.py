"""What notebooks show of a frame, a shot, a plan and a camera: pieces of HTML, self-contained, without scripts."""

from simulator.displays.notebook import display_html as display_html
