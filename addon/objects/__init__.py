"""Objects of the scene: sensors, indenters, electrodes, their meshes, keys and colours."""
