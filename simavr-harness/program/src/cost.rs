//! Measures the CPU time and memory that a run takes.

use serde::Serialize;

/// CPU time and memory of a run.
#[derive(Clone, Copy, Serialize)]
pub struct Cost {
    /// CPU time of all threads, in seconds.
    pub cpu_seconds: f64,
    /// CPU time of a module for each simulated second, in milliseconds.
    pub cpu_ms_per_module: f64,
    /// The most memory, in bytes, beyond what the program takes before it has a robot; `None` if the
    /// system does not report it.
    pub memory_bytes: Option<u64>,
}

/// The CPU time and memory that the process has used so far.
pub struct Used {
    cpu_seconds: f64,
    memory_bytes: Option<u64>,
}

impl Used {
    /// The use up to now.
    pub fn now() -> Self {
        Used { cpu_seconds: cpu_seconds(), memory_bytes: memory("VmRSS:") }
    }

    /// The cost since `self` of a robot of `modules` modules that ran for `seconds` seconds.
    pub fn since(&self, modules: usize, seconds: f64) -> Cost {
        let cpu_seconds = cpu_seconds() - self.cpu_seconds;
        let most = memory("VmHWM:").zip(self.memory_bytes);
        Cost {
            cpu_seconds,
            cpu_ms_per_module: 1000.0 * cpu_seconds / (modules.max(1) as f64 * seconds),
            memory_bytes: most.map(|(most, before)| most.saturating_sub(before)),
        }
    }
}

fn cpu_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the call writes one timespec, to which the pointer leads.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &raw mut time) };
    time.tv_sec as f64 + time.tv_nsec as f64 / 1e9
}

/// A value of `/proc/self/status`, in bytes.
fn memory(line: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let value = status.lines().find_map(|text| text.strip_prefix(line))?;
    let kilobytes: u64 = value.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kilobytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_and_memory_are_noticed() {
        let used = Used::now();
        // 128 MB: other tests of this process free some memory meanwhile.
        let work: Vec<u64> = std::hint::black_box((0..16_000_000).map(std::hint::black_box).collect());
        let cost = used.since(2, 0.5);
        assert!(cost.cpu_seconds > 0.0);
        assert!(
            (cost.cpu_ms_per_module - 1000.0 * cost.cpu_seconds).abs() < 1e-6,
            "two for half a second each"
        );
        assert!(cost.memory_bytes.is_none_or(|bytes| bytes > 20_000_000), "{:?}", cost.memory_bytes);
        drop(work);
    }
}
