# Extends gdb for programs of the kernel: `info tasks`, and how to find the callers of a function.

import itertools

import gdb
from gdb.unwinder import Unwinder, register_unwinder

# The bytes that a function has pushed when it reaches an instruction, by the instruction's address, as
# stack-bound follows the machine code. -1: the function has no caller, because a task begins there.
DEPTHS = {}

DATA = 0x800000
REGISTERS = [f"r{number}" for number in range(32)] + ["SREG"]


class FrameId:
    def __init__(self, sp, pc):
        self.sp = sp
        self.pc = pc


class Calls(Unwinder):
    """Finds the caller: the return address lies behind the bytes that the function has pushed."""

    def __init__(self):
        super().__init__("superbot")

    def __call__(self, frame):
        address = int(frame.read_register("pc")) & 0x1FFFF
        if frame.level() == 0:
            depth = DEPTHS.get(address)
        else:
            # After a call that does not return, another function may begin, so look at the call itself.
            depth = DEPTHS.get(address - 2, DEPTHS.get(address - 4))
        if depth is None:
            return None
        top = (int(frame.read_register("SP")) & 0xFFFF) + max(depth, 0)
        if depth < 0:
            above, caller = top, 0
        else:
            above = top + 2
            try:
                high, low = gdb.selected_inferior().read_memory(DATA + top + 1, 2)
            except gdb.MemoryError:
                return None  # the program has not set the stack pointer yet
            caller = 2 * (ord(high) << 8 | ord(low))
        info = frame.create_unwind_info(FrameId(gdb.Value(DATA + above), gdb.Value(address)))
        # It is not known which other registers the function has saved: they read as they are now.
        for name in REGISTERS:
            info.add_saved_register(name, frame.read_register(name))
        # gdb has the program counter twice: as the MCU has it, and as a pointer.
        for name, value in ("PC2", caller), ("pc", caller), ("SP", above):
            info.add_saved_register(name, gdb.Value(value).cast(frame.read_register(name).type))
        return info


class Callers:
    """Leaves out the frames that seem to call the function in which a task begins."""

    def __init__(self):
        self.name = "superbot"
        self.priority = 100
        self.enabled = True
        gdb.frame_filters[self.name] = self

    def filter(self, frames):
        return itertools.takewhile(lambda frame: frame.inferior_frame().pc() != 0, frames)


class InfoTasks(gdb.Command):
    """Print what each task does. Each task is also a thread of gdb: thread apply all backtrace."""

    def __init__(self):
        super().__init__("info tasks", gdb.COMMAND_STATUS)

    def invoke(self, argument, from_tty):
        gdb.write(gdb.execute("monitor tasks", to_string=True))


register_unwinder(None, Calls(), True)
Callers()
InfoTasks()
