//! Metrics of this process from the operating system, under the standard names of Prometheus
//! clients. They exist on Linux only.

use std::{fs, io};

use prometheus::{
    Counter, Error, Gauge, Opts,
    core::{Collector, Desc},
    proto::MetricFamily,
};

/// The unit of CPU time in the kernel, per second: `USER_HZ`, which is 100 for programs on every
/// current architecture of Linux (`proc(5)`, `time(7)`).
const TICKS_PER_SECOND: f64 = 100.0;
/// The unit of memory in `/proc/self/status`.
const KIBIBYTE: f64 = 1024.0;

/// The metrics of the process, read at every scrape.
pub(super) struct Process {
    cpu: Counter,
    resident: Gauge,
    virtual_memory: Gauge,
    open_fds: Gauge,
    max_fds: Gauge,
    threads: Gauge,
    start: Gauge,
}

impl Process {
    /// # Errors
    /// If Prometheus does not accept a name.
    pub(super) fn new() -> Result<Self, Error> {
        let gauge = |name: &str, help: &str| Gauge::with_opts(Opts::new(name, help));
        let cpu = Opts::new(
            "process_cpu_seconds_total",
            "CPU time spent by the process, user and system.",
        );
        Ok(Self {
            cpu: Counter::with_opts(cpu)?,
            resident: gauge(
                "process_resident_memory_bytes",
                "Resident memory of the process, bytes.",
            )?,
            virtual_memory: gauge(
                "process_virtual_memory_bytes",
                "Virtual memory of the process, bytes.",
            )?,
            open_fds: gauge(
                "process_open_fds",
                "Open file descriptors, including sockets.",
            )?,
            max_fds: gauge("process_max_fds", "Limit of open file descriptors.")?,
            threads: gauge("process_threads", "Threads of the process.")?,
            start: gauge(
                "process_start_time_seconds",
                "Start time of the process, seconds since 1970.",
            )?,
        })
    }

    fn parts(&self) -> [&dyn Collector; 7] {
        [
            &self.cpu,
            &self.resident,
            &self.virtual_memory,
            &self.open_fds,
            &self.max_fds,
            &self.threads,
            &self.start,
        ]
    }

    fn read(&self) -> io::Result<()> {
        let status = fs::read_to_string("/proc/self/status")?;
        for (gauge, key, unit) in [
            (&self.resident, "VmRSS:", KIBIBYTE),
            (&self.virtual_memory, "VmSize:", KIBIBYTE),
            (&self.threads, "Threads:", 1.0),
        ] {
            if let Some(value) = number_after(&status, key) {
                gauge.set(value * unit);
            }
        }
        let limits = fs::read_to_string("/proc/self/limits")?;
        if let Some(limit) = number_after(&limits, "Max open files") {
            self.max_fds.set(limit);
        }
        // The folder that is being read is open as well.
        let open = fs::read_dir("/proc/self/fd")?.count().saturating_sub(1);
        self.open_fds
            .set(f64::from(u32::try_from(open).unwrap_or(u32::MAX)));

        let stat = fs::read_to_string("/proc/self/stat")?;
        if let Some(times) = Times::of(&stat) {
            let spent = times.cpu_ticks / TICKS_PER_SECOND;
            self.cpu.inc_by((spent - self.cpu.get()).max(0.0));
            let system = fs::read_to_string("/proc/stat")?;
            if let Some(boot) = number_after(&system, "btime") {
                self.start.set(boot + times.start_ticks / TICKS_PER_SECOND);
            }
        }
        Ok(())
    }
}

impl Collector for Process {
    fn desc(&self) -> Vec<&Desc> {
        self.parts().into_iter().flat_map(Collector::desc).collect()
    }

    fn collect(&self) -> Vec<MetricFamily> {
        // A system without /proc has no such metrics.
        if self.read().is_err() {
            return Vec::new();
        }
        let parts = self.parts().into_iter();
        parts.flat_map(Collector::collect).collect()
    }
}

/// The first number of the line that begins with `key`.
fn number_after(text: &str, key: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The times in `/proc/self/stat`, in ticks.
struct Times {
    cpu_ticks: f64,
    /// Since the boot of the machine.
    start_ticks: f64,
}

impl Times {
    /// Reads fields 14, 15 and 22 of `proc_pid_stat(5)`. The second field is a name in brackets
    /// that may contain spaces and brackets.
    fn of(stat: &str) -> Option<Self> {
        let (_, after_name) = stat.rsplit_once(')')?;
        let fields: Vec<_> = after_name.split_whitespace().collect();
        let field = |number: usize| fields.get(number - 3)?.parse::<f64>().ok();
        Some(Self {
            cpu_ticks: field(14)? + field(15)?,
            start_ticks: field(22)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_after_a_name_with_brackets_are_found() {
        let stat = "42 (a) b (c) S 1 2 3 4 5 6 7 8 9 10 150 50 13 14 15 16 17 18 9000 20";
        let times = Times::of(stat).unwrap();
        assert_eq!((times.cpu_ticks, times.start_ticks), (200.0, 9000.0));
        assert!(Times::of("42 (short) S 1").is_none());
        assert!(Times::of("").is_none());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_metrics_of_this_process_are_plausible() {
        let process = Process::new().unwrap();
        process.read().unwrap();
        // Other tests open files, too, so only rough bounds hold.
        let open = process.open_fds.get();
        assert!((1.0..=process.max_fds.get()).contains(&open), "{open}");
        assert!(process.threads.get() >= 1.0);
        let (resident, whole) = (process.resident.get(), process.virtual_memory.get());
        assert!(resident > 1e6 && resident <= whole, "{resident} of {whole}");
        let now = std::time::SystemTime::now();
        let now = now.duration_since(std::time::UNIX_EPOCH).unwrap();
        let age = now.as_secs_f64() - process.start.get();
        assert!((-2.0..86_400.0).contains(&age), "{age}");
        assert_eq!(process.collect().len(), 7);
    }
}
