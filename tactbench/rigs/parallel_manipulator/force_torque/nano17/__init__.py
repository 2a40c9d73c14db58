"""An ATI Nano17 by its six gauge voltages, digitised by a microcontroller on a byte stream."""
