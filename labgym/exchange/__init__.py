"""Files for engineers: drawings, plans, bills of materials and robot maps of layouts; floors and inventories to read."""
