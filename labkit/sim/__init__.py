"""PyBullet worlds: a scene as plain data, the world that simulates and renders it, and the arm that acts in it."""
