"""One file a layout, found by itself. Each has

``NAME``     the layout in words
``PATTERN``  regular expression of the name of a frame's nodes, with groups step, environment and, where there are
             such, trial and sensor
``read(file, found) -> Deformation``  the frame that a name stands for
"""
