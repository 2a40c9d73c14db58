"""The ATI force-torque sensor: by gauge voltages and a calibration file, or by a Net F/T box over UDP."""
