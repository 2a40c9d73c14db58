"""What can go wrong with the motor and its drive, by name.

::

    MotorError                        (a RigError)
    ├── MotorRefusalError             the drive refuses a command, by its own text
    │   ├── CommandUnknownError
    │   ├── ParameterInvalidError
    │   ├── CommandNotAvailableError
    │   ├── DriveTooHotError
    │   └── FlashDefectError
    ├── AnswerMissingError            a command was not answered
    ├── MotorSilentError              nothing is answered any more
    ├── WrongGenerationError          another protocol
    ├── SettingNotKeptError           what was read back is not what was set
    ├── MotorFaultError               the drive reports a fault, or is not where it was sent
    ├── MotorStalledError             a move or homing did not end in time
    └── MotorNotReadyError            a move that is not allowed now
"""

from __future__ import annotations

from tactbench.plugin import RigError
from tactbench.rigs.parallel_manipulator.motor.codec import (
    FLASH_DEFECT,
    INVALID_PARAMETER,
    NOT_AVAILABLE,
    OVERTEMPERATURE,
    UNKNOWN_COMMAND,
)


class MotorError(RigError):
    """The motor or its drive does not do what it was asked for."""


class MotorSilentError(MotorError):
    """The drive does not answer any more."""


class AnswerMissingError(MotorError):
    """A command was not answered in time; whether it was carried out is not known."""


class MotorRefusalError(MotorError):
    """The drive refuses a command."""


class CommandUnknownError(MotorRefusalError):
    """``Unknown command``."""


class ParameterInvalidError(MotorRefusalError):
    """``Invalid parameter``."""


class CommandNotAvailableError(MotorRefusalError):
    """``Command not available``."""


class DriveTooHotError(MotorRefusalError):
    """``Overtemperature - drive disabled``."""


class FlashDefectError(MotorRefusalError):
    """``Flash defect``."""


class WrongGenerationError(MotorError):
    """The drive speaks the newer, binary protocol."""


class MotorFaultError(MotorError):
    """The drive reports a fault; the motor is without power until it is over and the drive is enabled again."""


class MotorNotReadyError(MotorError):
    """A move was asked for that is not allowed now, or at all; nothing was sent."""


class MotorStalledError(MotorError):
    """A move did not reach its target in its time."""


class SettingNotKeptError(MotorError):
    """The drive does not have what it was told."""


REFUSALS: dict[str, tuple[type[MotorRefusalError], str]] = {
    UNKNOWN_COMMAND: (CommandUnknownError, "Is it a Faulhaber drive of the 300x RS generation?"),
    INVALID_PARAMETER: (ParameterInvalidError, "Check the options in the rig file against the drive's manual."),
    NOT_AVAILABLE: (CommandNotAvailableError, "Is the drive enabled, and does it have this command?"),
    OVERTEMPERATURE: (DriveTooHotError, "Let it cool down, then enable it again."),
    FLASH_DEFECT: (FlashDefectError, "The drive cannot keep settings: ask its maker."),
}
"""By the text of the drive: the error, and its hint."""
