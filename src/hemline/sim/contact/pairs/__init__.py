"""Contact in pairs: the cloth with itself, with vertices of the body, and with capsules around bones."""
