//! A second emulator: the kernel's test images do the same in QEMU as in simavr.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use simavr_harness::{Image, State};
use superbot_tests_simavr::MILLISECOND;
use superbot_tests_simavr::marks::values;
use superbot_tests_simavr::qemu::{Hung, MACHINES, Machine};

/// More time than any of these programs needs in QEMU, on a loaded machine too.
const PATIENCE: Duration = Duration::from_secs(30);

/// The time in which a program ends on any machine, if it ends at all.
const SHORT: Duration = Duration::from_secs(2);

/// The image's marks in simavr.
fn in_simavr(machine: &Machine, name: &str) -> Vec<u8> {
    let target = machine.target();
    let mut mcu = target.mcu(target.image(name));
    assert_eq!(mcu.run_to_end(1_000 * MILLISECOND), State::Done, "{name} in simavr");
    values(mcu.markers())
}

/// The image's output in QEMU.
fn in_qemu(machine: &Machine, name: &str, limit: Duration) -> Result<Vec<u8>, Hung> {
    machine.run(&machine.image(name), limit)
}

#[test]
fn tasks_run_and_delays_end_in_the_same_order_in_qemu() {
    for machine in &MACHINES {
        for name in ["preemption", "semaphore", "queue", "timer"] {
            let seen = in_qemu(machine, name, PATIENCE);
            assert_eq!(seen, Ok(in_simavr(machine, name)), "{name} on the {}", machine.mcu);
        }
    }
}

/// QEMU has no pins, so a timer interrupts once in each tick. The moment depends on the speed of the host,
/// and so does the progress of the busy task.
#[test]
fn an_interrupt_preempts_a_busy_task_and_leaves_its_registers_in_qemu() {
    const BEGUN: u8 = 1;
    const WOKEN: u8 = 2;
    const RIGHT: u8 = 3;
    for machine in &MACHINES {
        let marks = in_qemu(machine, "interrupt", PATIENCE).expect("it comes to its end");
        let count = |mark| marks.iter().filter(|&&other| other == mark).count();
        assert_eq!((count(BEGUN), count(WOKEN)), (1, 3), "{}: {marks:02x?}", machine.mcu);
        assert!(count(RIGHT) > 0, "{}: the busy task gets on", machine.mcu);
        assert_eq!(count(RIGHT) + 4, marks.len(), "{}: a wrong sum: {marks:02x?}", machine.mcu);
    }
}

/// Builds `fixtures/skip.S` with a skip over this instruction.
fn skip_over(machine: &Machine, instruction: &str, number: usize) -> std::path::PathBuf {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/skip.S");
    let elf = format!("skip-{}-{number}-{}.elf", machine.mcu, std::process::id());
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(elf);
    let status = Command::new("avr-gcc")
        .args([&format!("-mmcu={}", machine.mcu), &format!("-DOVER={instruction}"), "-o"])
        .args([&elf, &fixture])
        .status()
        .expect("avr-gcc runs (Debian: gcc-avr and avr-libc; ./x test installs them)");
    assert!(status.success(), "avr-gcc builds {}", fixture.display());
    elf
}

/// QEMU's fault without the kernel: after a skip over an instruction that jumps to an address from the stack
/// or Z, the program does not continue. Prints what this QEMU does with each; a QEMU without the fault is
/// fine, too.
#[test]
fn a_skip_over_an_indirect_jump_goes_wrong_in_qemu() {
    const RIGHT: [&str; 3] = ["nop", "rjmp not_skipped", "rcall not_skipped"];
    const WRONG: [&str; 4] = ["ret", "reti", "ijmp", "icall"];
    for machine in &MACHINES {
        for (number, instruction) in RIGHT.into_iter().chain(WRONG).enumerate() {
            let elf = skip_over(machine, instruction, number);
            let image = Arc::new(Image::load(&elf).expect("avr-gcc makes an AVR image"));
            let mut mcu = machine.target().mcu(image);
            assert_eq!(mcu.run_to_end(1_000 * MILLISECOND), State::Done, "{instruction} in simavr");
            let sent: Vec<_> = mcu.take_sent(0).iter().map(|character| character.value).collect();
            assert!(sent.starts_with(b"ab\xff"), "{instruction} in simavr: {sent:02x?}");

            let seen = machine.run(&elf, if RIGHT.contains(&instruction) { PATIENCE } else { SHORT });
            println!("{}: a skip over {instruction}: {seen:02x?}", machine.mcu);
            if RIGHT.contains(&instruction) {
                assert_eq!(seen, Ok(b"ab".to_vec()), "{instruction} in QEMU");
            }
            std::fs::remove_file(elf).expect("it can be removed");
        }
    }
}
