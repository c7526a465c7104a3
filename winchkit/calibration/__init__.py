"""Parameters with uncertainties from measurements made for them: load cells, robot geometry."""
