"""What raw frames tell about the camera that took them."""
