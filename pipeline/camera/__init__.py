"""Real pictures in, ranked grasps out: files, support, workspace, proposals."""
