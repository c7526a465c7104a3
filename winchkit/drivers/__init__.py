"""What talks to hardware: CAN buses, CiA 402 axes, Modbus instruments."""
