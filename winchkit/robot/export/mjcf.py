def robot_mjcf(robot, lines):
    return "", []
