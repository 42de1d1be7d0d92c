"""The SDO server: transfers in each direction, requests that are none, blocks (CiA 301 v4.2.0, 7.2.4)."""
