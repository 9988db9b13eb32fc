//! Writes the levels of pins and buses over time as a file of value changes (VCD: IEEE 1364, "Value change
//! dump files"), which GTKWave, Surfer and PulseView read.

use std::collections::BTreeMap;
use std::io;

use simavr_harness::{BusSignal, Line, Slice, bus_lines, motor_lines, serial_line};
use vcd::{IdCode, TimescaleUnit, Writer};

use super::Traced;
use super::flows::dock;

/// The unit of time is 100 ps, of which a cycle has 625: it lasts 62.5 ns.
const UNITS: (u32, TimescaleUnit) = (100, TimescaleUnit::PS);
const CYCLE: u64 = 625;

/// The file, with the signals on the buses of traced modules.
///
/// # Errors
/// A name is not valid in such a file.
pub fn write(traced: &[Traced], buses: &BTreeMap<usize, Vec<Slice<BusSignal>>>) -> io::Result<String> {
    let mut writer = Writer::new(Vec::new());
    writer.timescale(UNITS.0, UNITS.1)?;
    let mut lines: Vec<(IdCode, Line)> = Vec::new();
    for Traced { name, trace, control } in traced {
        let end = trace.end;
        let ports = trace
            .serial
            .iter()
            .enumerate()
            .filter_map(|(port, serial)| Some((dock(name.controller, port)?, serial)));
        let serial = ports.flat_map(|(dock, serial)| {
            [
                serial_line(format!("{dock:?}_sends"), &serial.sent),
                serial_line(format!("{dock:?}_hears"), &serial.received),
            ]
        });
        let control = Line { name: "control".into(), is_high: false, edges: control.clone() };
        let of_mcu: Vec<Line> = serial
            .chain(motor_lines(trace, name.controller))
            .chain([control])
            .map(|line| until(line, end))
            .collect();
        add(&mut writer, &mut lines, &name.to_string().replace('.', "_"), of_mcu)?;
    }
    for (module, signals) in buses {
        add(&mut writer, &mut lines, &format!("{module}_bus"), bus_lines(signals).into())?;
    }
    writer.enddefinitions()?;
    writer.timestamp(0)?;
    for (id, line) in &lines {
        writer.change_scalar(*id, line.is_high)?;
    }
    let changes =
        lines.iter().flat_map(|(id, line)| line.edges.iter().map(|edge| (edge.cycle, *id, edge.level)));
    let mut changes: Vec<(u64, IdCode, bool)> = changes.collect();
    changes.sort_by_key(|&(cycle, ..)| cycle);
    let mut now = 0;
    for (cycle, id, level) in changes {
        if cycle > now {
            now = cycle;
            writer.timestamp(now * CYCLE)?;
        }
        writer.change_scalar(id, level)?;
    }
    // An MCU that never had power has not run.
    let ran = traced.iter().filter(|traced| !traced.trace.cpu.is_empty());
    let end = ran.map(|traced| traced.trace.end).max().unwrap_or(0);
    if end > now {
        writer.timestamp(end * CYCLE)?;
    }
    writer.flush()?;
    String::from_utf8(std::mem::take(writer.writer())).map_err(io::Error::other)
}

fn add(
    writer: &mut Writer<Vec<u8>>,
    lines: &mut Vec<(IdCode, Line)>,
    scope: &str,
    of_scope: Vec<Line>,
) -> io::Result<()> {
    writer.add_module(scope)?;
    for line in of_scope {
        lines.push((writer.add_wire(1, &line.name)?, line));
    }
    writer.upscope()
}

/// Drops the edges after the end of the run.
fn until(mut line: Line, end: u64) -> Line {
    line.edges.retain(|edge| edge.cycle <= end);
    line
}
