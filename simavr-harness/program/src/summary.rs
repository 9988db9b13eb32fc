//! The report as text.

use std::fmt;

use simulation::{BridgeTotals, LinkTotals};

use super::cost::Cost;
use super::report::{Broken, CpuLoad, Last, Latency, Reconfiguration, Report};

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Report { modules, mcus, simulated_seconds, wall_seconds, .. } = self;
        let or_none =
            |value: Option<f64>, unit: &str| value.map_or("-".into(), |value| format!("{value:.0} {unit}"));
        let types: Vec<String> = self.types.iter().map(|(name, number)| format!("{number} {name}")).collect();
        let topology = if self.topology_correct { "as wired" } else { "NOT as wired" };
        let mcus = if *mcus > 0 { format!(", {mcus} MCUs") } else { String::new() };
        writeln!(f, "{modules} modules{mcus}: {simulated_seconds} s simulated in {wall_seconds:.2} s")?;
        writeln!(f, "types      {} ({topology})", types.join(", "))?;
        let loss =
            self.loss_notice_ms_max.map_or(String::new(), |ms| format!(", a loss noticed after {ms:.0} ms"));
        writeln!(
            f,
            "discovery  neighbours found after {} at most{loss}, {} lapses",
            or_none(self.discovery_ms_max, "ms"),
            self.topology_lapses
        )?;
        for Reconfiguration { at, attach, detach } in &self.reconfigurations {
            if let Some([one, other]) = attach {
                writeln!(f, "docking    {one} attached itself to {other} after {at:.2} s")?;
            }
            if let Some(face) = detach {
                writeln!(f, "docking    {face} let go after {at:.2} s")?;
            }
        }
        if self.legs > 0 {
            writeln!(
                f,
                "gait       {} legs, {} violations; left and right start {} apart at most",
                self.legs,
                self.gait_violations,
                or_none(self.leg_skew_us_max, "us")
            )?;
        }
        writeln!(
            f,
            "hormones   {} sent, {} delivered, {} dropped, {} lost, {} out of turn",
            self.hormones_sent,
            self.hormones_delivered,
            self.hormones_dropped,
            self.hormones_lost,
            self.hormones_out_of_turn
        )?;
        if let (Some(Latency { mean, max }), Some(over_wire)) = (&self.hop_latency_us, self.hop_over_wire) {
            writeln!(
                f,
                "hop        {mean:.0} us mean, {over_wire:.2} times the wires' limit; {max:.0} us at most"
            )?;
        }
        if let Some(distance) = self.distance_m {
            // No -0.000.
            let distance = (1000.0 * distance).round() / 1000.0 + 0.0;
            let percent = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.1} %"));
            writeln!(
                f,
                "motion     {distance:.3} m ahead, {:.2} body lengths, {} sideways, heading {:+.1} degrees, {} slip, \
                 leaning by {:.0} degrees at most",
                (100.0 * self.body_lengths.unwrap_or_default()).round() / 100.0 + 0.0,
                percent(self.sideways_percent),
                self.heading_degrees.unwrap_or_default(),
                percent(self.slip_percent),
                self.tilt_degrees_max.unwrap_or_default()
            )?;
        }
        if let Some(used) = self.charge_percent_max {
            let far = self.metres_per_charge.map_or_else(String::new, |it| format!(": {it:.0} m per charge"));
            writeln!(f, "battery    {used:.2} % of a charge used at most{far}")?;
        }
        if !self.varied_percent.is_empty() {
            let varied = self.varied_percent.iter().map(|(name, percent)| format!("{name} by {percent} %"));
            writeln!(f, "varied     {}; seed {}", varied.collect::<Vec<_>>().join(", "), self.seed)?;
        }
        if let Some(CpuLoad { master, slave }) = &self.cpu_load {
            writeln!(
                f,
                "CPU awake  master {:.1} % (at most {:.1} %), slave {:.1} % (at most {:.1} %)",
                100.0 * master.mean,
                100.0 * master.max,
                100.0 * slave.mean,
                100.0 * slave.max
            )?;
        }
        let LinkTotals { frames, retries, errors, gave_up, no_buffer } = self.link;
        writeln!(
            f,
            "links      {frames} frames, {retries} repeated, {errors} errors, {gave_up} messages given up, \
             {no_buffer} without a buffer"
        )?;
        let BridgeTotals { messages, retries, errors, gave_up, no_buffer } = self.bridge;
        writeln!(
            f,
            "bridges    {messages} messages, {retries} repeated, {errors} errors, {gave_up} given up, \
             {no_buffer} without a buffer"
        )?;
        if let Some(Broken { last, .. }) = &self.trouble {
            writeln!(
                f,
                "\nthe last values of the joint that broke:\n{:>9} {:>9} {:>11} {:>7}",
                "s", "degrees", "degrees/s", "V"
            )?;
            let number = |value: Option<f64>| value.map_or("none".into(), |value| format!("{value:.1}"));
            for Last { seconds, degrees, degrees_per_second, volts } in last {
                let [degrees, speed] = [degrees, degrees_per_second].map(|value| number(*value));
                writeln!(f, "{seconds:9.3} {degrees:>9} {speed:>11} {volts:7.2}")?;
            }
            writeln!(f)?;
        }
        let Cost { cpu_ms_per_module, memory_bytes, .. } = self.cost;
        let memory = memory_bytes.map(|bytes| bytes as f64 / 1e3 / self.modules.max(1) as f64);
        let memory = memory.map_or(String::new(), |kilobytes| format!(", and {kilobytes:.0} KB of memory"));
        writeln!(f, "simulator  each module takes {cpu_ms_per_module:.1} ms of CPU time a second{memory}")?;
        writeln!(f, "state hash {}", self.state_hash)
    }
}
