"""ROS bags: their topics, the messages in them, and the BioTacs in these."""
