//! The commands.

use super::Machine;
use super::words::{number, to_digit, words};
use crate::control::{Refused, TaskHandle, TaskState};
use crate::control_block::Priority;
use crate::flash::Flash;

/// Bytes in a line of a reply.
const ROW: usize = 16;

/// Bytes of a return address.
const PROGRAM_COUNTER: u16 = if cfg!(target_feature = "eijmpcall") { 3 } else { 2 };

/// Offsets in a preempted context, from its lowest byte: r17 down to r2, r29, r28, r27 down to r18, r1, SREG,
/// r0, r30, r31, and the PC with its high byte first.
const STATUS: u16 = 29;
const PC: u16 = 33;

/// An error in a command.
enum Mistake {
    Unknown,
    Missing,
    TooMuch,
    Address,
    Count,
    Byte,
    NoTask,
    Priority,
    Itself,
    NotSuspended,
    NotPreempted,
    TooLong,
    Refused(Refused),
}

impl From<Refused> for Mistake {
    fn from(refused: Refused) -> Self {
        Mistake::Refused(refused)
    }
}

/// Puts a text that lies in flash.
macro_rules! say {
    ($machine:expr, $text:literal) => {{
        crate::flash! { static TEXT: [u8; $text.len()] = *$text; }
        say($machine, &TEXT)
    }};
}

/// Executes the command in `line`, and puts the reply: lines that end in CR LF. An error is reported in a
/// line that begins with `?`. The command has done nothing then, except for `n`: its step may be made
/// although the registers can't be shown.
pub fn obey(line: &[u8], machine: &mut impl Machine) {
    if let Err(mistake) = command(line, machine) {
        explain(machine, mistake);
    }
}

/// The reply to a line of more than [`LINE`](super::LINE) bytes.
pub fn refuse_line(machine: &mut impl Machine) {
    explain(machine, Mistake::TooLong);
}

fn command(line: &[u8], machine: &mut impl Machine) -> Result<(), Mistake> {
    let mut arguments = words(line);
    let Some(command) = arguments.next() else { return Ok(()) };
    match command {
        b"h" => end(arguments).map(|()| help(machine)),
        b"l" => end(arguments).map(|()| list(machine)),
        b"r" => {
            let address = address(arguments.next())?;
            let count = match arguments.next() {
                Some(word) => number(word, 2).filter(|count| *count > 0).ok_or(Mistake::Count)?,
                None => 1,
            };
            end(arguments)?;
            dump(machine, address, count);
            Ok(())
        }
        b"w" => {
            let address = address(arguments.next())?;
            let bytes = arguments.map(|word| number(word, 2));
            // Checks all of them first, so that an error leaves memory unchanged.
            let count = words(line).skip(2).try_fold(0u16, |count, word| {
                number(word, 2).map(|_| count.wrapping_add(1)).ok_or(Mistake::Byte)
            })?;
            if count == 0 {
                return Err(Mistake::Missing);
            }
            for (offset, byte) in (0u16..).zip(bytes.flatten()) {
                machine.write(address.wrapping_add(offset), byte as u8);
            }
            done(machine)
        }
        b"s" | b"g" | b"n" | b"k" | b"x" => {
            let task = find(machine, arguments.next())?;
            end(arguments)?;
            match command {
                b"s" => other(machine, task)?.suspend(machine.monitor())?,
                b"g" => {
                    if !task.resume(machine.monitor()) {
                        return Err(Mistake::NotSuspended);
                    }
                }
                b"n" => {
                    machine.step(task)?;
                    return registers(machine, task);
                }
                b"k" => other(machine, task)?.kill(machine.monitor())?,
                _ => return registers(machine, task),
            }
            done(machine)
        }
        b"p" => {
            let task = find(machine, arguments.next())?;
            let index = arguments.next().ok_or(Mistake::Missing)?;
            let priority = number(index, 1).and_then(|index| Priority::ALL.get(usize::from(index)));
            end(arguments)?;
            task.set_priority(machine.monitor(), *priority.ok_or(Mistake::Priority)?)?;
            done(machine)
        }
        _ => Err(Mistake::Unknown),
    }
}

// ---- Arguments -----------------------------------------------------------------------------------

fn end<'a>(mut arguments: impl Iterator<Item = &'a [u8]>) -> Result<(), Mistake> {
    arguments.next().map_or(Ok(()), |_| Err(Mistake::TooMuch))
}

fn address(word: Option<&[u8]>) -> Result<u16, Mistake> {
    number(word.ok_or(Mistake::Missing)?, 4).ok_or(Mistake::Address)
}

/// The task with that name, or otherwise with that number in the list.
fn find(machine: &impl Machine, word: Option<&[u8]>) -> Result<TaskHandle, Mistake> {
    let word = word.ok_or(Mistake::Missing)?;
    let tasks = machine.tasks();
    let named = tasks.iter().find(|(name, _)| name.as_bytes() == word);
    let numbered = || number(word, 2).and_then(|index| tasks.get(usize::from(index)));
    named.or_else(numbered).map(|(_, task)| *task).ok_or(Mistake::NoTask)
}

/// `task`, unless it is the monitor's own.
fn other(machine: &mut impl Machine, task: TaskHandle) -> Result<TaskHandle, Mistake> {
    if task.as_self(machine.monitor()).is_some() { Err(Mistake::Itself) } else { Ok(task) }
}

// ---- Replies -------------------------------------------------------------------------------------

fn help(machine: &mut impl Machine) {
    say!(machine, b"all numbers are hexadecimal; TASK is a name or a number that l shows\r\n");
    say!(machine, b"l                list the tasks\r\n");
    say!(machine, b"r ADDRESS COUNT  read memory; without COUNT one byte\r\n");
    say!(machine, b"w ADDRESS BYTE.. write memory\r\n");
    say!(machine, b"s TASK           suspend it\r\n");
    say!(machine, b"g TASK           let it go on\r\n");
    say!(machine, b"n TASK           run its next instruction, once it is suspended\r\n");
    say!(machine, b"x TASK           show its registers, once it is suspended\r\n");
    say!(machine, b"k TASK           kill it\r\n");
    say!(machine, b"p TASK N         give it priority N, 0 to 7\r\n");
}

fn list(machine: &mut impl Machine) {
    for (index, (name, task)) in (0u8..).zip(machine.tasks()) {
        put_byte(machine, index);
        machine.put(b' ');
        name.bytes().for_each(|byte| machine.put(byte));
        machine.put(b' ');
        let state = task.state(machine.monitor());
        match state {
            TaskState::NotStarted => say!(machine, b"not started"),
            TaskState::Ready => say!(machine, b"ready"),
            TaskState::Waiting => say!(machine, b"waiting"),
            TaskState::Suspended => say!(machine, b"suspended"),
            TaskState::Killed => say!(machine, b"killed"),
        }
        if state != TaskState::NotStarted {
            say!(machine, b" p");
            let priority = task.priority(machine.monitor());
            machine.put(to_digit(priority as u8));
            say!(machine, b" sp ");
            let saved = machine.stack_pointer(*task);
            let last = saved & 0x7fff;
            // A voluntary context's stack pointer points at the first free byte, a preempted one's at the
            // last byte in use.
            let pointer = if is_preempted(saved) { last.wrapping_sub(1) } else { last };
            put_word(machine, pointer);
            say!(machine, b" free ");
            let bottom = machine.stack_bottom(*task);
            put_word(machine, pointer.wrapping_sub(bottom).wrapping_add(1));
        }
        put_end(machine);
    }
}

fn dump(machine: &mut impl Machine, address: u16, count: u16) {
    for offset in 0..count {
        let place = address.wrapping_add(offset);
        if usize::from(offset) % ROW == 0 {
            if offset > 0 {
                put_end(machine);
            }
            put_word(machine, place);
        }
        machine.put(b' ');
        let byte = machine.read(place);
        put_byte(machine, byte);
    }
    put_end(machine);
}

/// Shows the registers of a task that was preempted by an interrupt and has been suspended since.
fn registers(machine: &mut impl Machine, task: TaskHandle) -> Result<(), Mistake> {
    match task.state(machine.monitor()) {
        TaskState::NotStarted => return Err(Mistake::Refused(Refused::NotStarted)),
        TaskState::Suspended | TaskState::Killed => {}
        TaskState::Ready | TaskState::Waiting => return Err(Mistake::NotSuspended),
    }
    let saved = machine.stack_pointer(task);
    if !is_preempted(saved) {
        return Err(Mistake::NotPreempted);
    }
    let context = saved & 0x7fff;
    say!(machine, b"pc ");
    put_program_counter(machine, context.wrapping_add(PC));
    say!(machine, b" sp ");
    put_word(machine, context.wrapping_add(PC + PROGRAM_COUNTER - 1));
    say!(machine, b" sreg ");
    // Bit 7 of the saved SREG holds RAMPZ. In the task itself interrupts are enabled.
    let status = machine.read(context.wrapping_add(STATUS)) | 0x80;
    put_byte(machine, status);
    for register in 0..32 {
        if usize::from(register) % ROW == 0 {
            put_end(machine);
            machine.put(b'r');
            put_byte(machine, register);
        }
        machine.put(b' ');
        let value = machine.read(context.wrapping_add(place(register)));
        put_byte(machine, value);
    }
    put_end(machine);
    Ok(())
}

/// The offset of a register in a preempted context.
fn place(register: u8) -> u16 {
    match register {
        0 => 30,
        1 => 28,
        2..=17 => 17u16.wrapping_sub(register.into()),
        18..=29 => 45u16.wrapping_sub(register.into()),
        30 => 31,
        _ => 32,
    }
}

/// Puts the PC as an address in bytes, as listings have it; the MCU counts words.
fn put_program_counter(machine: &mut impl Machine, place: u16) {
    let mut bytes = [0; 3];
    for (byte, offset) in bytes.iter_mut().rev().zip((0..PROGRAM_COUNTER).rev()) {
        *byte = machine.read(place.wrapping_add(offset));
    }
    let [high, middle, low] = bytes;
    // The upper half of the third byte may hold RAMPZ.
    put_byte(machine, (high & 0x0f) << 1 | middle >> 7);
    put_word(machine, u16::from_be_bytes([middle, low]) << 1);
}

fn is_preempted(saved: u16) -> bool {
    saved & 0x8000 != 0
}

fn done(machine: &mut impl Machine) -> Result<(), Mistake> {
    say!(machine, b"done\r\n");
    Ok(())
}

fn explain(machine: &mut impl Machine, mistake: Mistake) {
    say!(machine, b"? ");
    match mistake {
        Mistake::Unknown => say!(machine, b"no such command: h shows all"),
        Mistake::Missing => say!(machine, b"something is missing: h shows what each command takes"),
        Mistake::TooMuch => say!(machine, b"too many words: h shows what each command takes"),
        Mistake::Address => say!(machine, b"an address is up to 4 hexadecimal digits"),
        Mistake::Count => say!(machine, b"a count is 1 to ff, hexadecimal"),
        Mistake::Byte => say!(machine, b"a byte is 1 or 2 hexadecimal digits; nothing was written"),
        Mistake::NoTask => say!(machine, b"no such task: l shows all"),
        Mistake::Priority => say!(machine, b"a priority is 0 to 7"),
        Mistake::Itself => say!(machine, b"that is the monitor itself, which is needed to go on"),
        Mistake::NotSuspended => say!(machine, b"it is not suspended: s suspends it"),
        Mistake::NotPreempted => {
            say!(machine, b"it gave way by itself, its registers are not saved: n, then x")
        }
        Mistake::TooLong => {
            say!(machine, b"the line is too long, up to 48 characters are read: write in pieces")
        }
        Mistake::Refused(Refused::NotStarted) => say!(machine, b"no task runs there: l shows which do"),
        Mistake::Refused(Refused::Busy) => {
            say!(machine, b"not now: it waits, or has a mutex, or is not suspended; l shows its state")
        }
    }
    put_end(machine);
}

#[inline(never)]
fn say(machine: &mut impl Machine, text: &Flash<[u8]>) {
    text.iter().for_each(|byte| machine.put(byte));
}

fn put_word(machine: &mut impl Machine, word: u16) {
    let [high, low] = word.to_be_bytes();
    put_byte(machine, high);
    put_byte(machine, low);
}

fn put_byte(machine: &mut impl Machine, byte: u8) {
    machine.put(to_digit(byte >> 4));
    machine.put(to_digit(byte));
}

fn put_end(machine: &mut impl Machine) {
    machine.put(b'\r');
    machine.put(b'\n');
}
