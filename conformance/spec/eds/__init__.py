"""Electronic data sheets (CiA 306): read, turned into a device spec, written, held against one."""
