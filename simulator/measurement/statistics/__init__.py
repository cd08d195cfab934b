"""What raw frames tell about the camera that took them, in the terms of EMVA 1288 Release 4.0 Linear."""
