"""What `batch_pictures` passes frames through, each a twin in torch of a module in numpy."""
