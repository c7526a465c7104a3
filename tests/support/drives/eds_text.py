"""A small EDS in order, for tests that damage it."""

from __future__ import annotations

from pathlib import Path

GOOD = """\
[FileInfo]
FileName=good.eds
[DeviceInfo]
VendorName=Nobody
VendorNumber=0x12
ProductNumber=3
NrOfTXPDO=4
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0
[1001]
ParameterName=Error register
ObjectType=0x7
DataType=0x0005
AccessType=ro
PDOMapping=1
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=ro
DefaultValue=1
[1018sub1]
ParameterName=Vendor
DataType=0x0007
AccessType=ro
DefaultValue=0x12
[OptionalObjects]
SupportedObjects=2
1=0x1014
2=0x6064
[1014]
ParameterName=COB-ID EMCY
ObjectType=0x7
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x80
[6064]
ParameterName=Position actual value
ObjectType=0x7
DataType=0x0004
AccessType=ro
LowLimit=-5
HighLimit=0x7FFFFFFF
PDOMapping=1
[ManufacturerObjects]
SupportedObjects=0
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "drive.eds"
    path.write_text(text, encoding="utf-8")
    return path
