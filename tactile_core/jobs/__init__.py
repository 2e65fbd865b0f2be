"""What the verbs do: a recording, scene or folder in, a result folder out."""
