"""Cases in which ray/triangle tests fail: meshes, rays, and what is true of them."""
