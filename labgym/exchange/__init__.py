"""Files for engineers: drawings, plans, bills of materials and robot maps; floors and inventories to read."""
