"""The reference of the privileged track: a robot that knows the world as it is and will be."""
