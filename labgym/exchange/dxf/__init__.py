"""DXF drawings: layouts to write and floors to read. Requires the extra `cad`."""
