"""What stands in the scene: sensors, indenters, electrodes, their meshes, keys and colours."""
