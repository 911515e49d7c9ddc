"""What lies where and what sees it: scenes, bodies at poses, one ray cast, one pinhole camera."""
