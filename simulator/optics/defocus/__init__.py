"""Plans the defocus blur of a scene's surfaces and tabulates what the kernels need for it."""
