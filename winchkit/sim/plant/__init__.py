"""The simulated mechanics: drum, cable, pulleys, load, servo loops and sensors, over time."""
