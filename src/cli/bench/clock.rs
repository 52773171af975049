//! What a run took: wall and processor time, the machine and the day.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Time, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spent {
    /// On the wall.
    pub wall: f64,
    /// Of all processors together, user and system; `None` where the system does not say.
    pub cpu: Option<f64>,
}

impl Spent {
    /// Time that counts for a device: of processors where it is one (`on_cpu`), as others may hold up the wall clock.
    pub fn counted(&self, on_cpu: bool) -> f64 {
        self.cpu.filter(|_| on_cpu).unwrap_or(self.wall)
    }
}

/// A stopwatch that can be held while something is done that is not to count.
pub struct Clock {
    since: (Instant, Option<f64>),
    before: Spent,
}

impl Clock {
    /// Runs from now.
    pub fn start() -> Self {
        Clock { since: (Instant::now(), cpu_seconds()), before: Spent { wall: 0.0, cpu: Some(0.0) } }
    }

    /// Time so far.
    pub fn spent(&self) -> Spent {
        let cpu = cpu_seconds().zip(self.since.1).zip(self.before.cpu).map(|((now, since), before)| before + now - since);
        Spent { wall: self.before.wall + self.since.0.elapsed().as_secs_f64(), cpu }
    }

    /// Does what is not to count.
    pub fn hold<T>(&mut self, work: impl FnOnce(Spent) -> T) -> T {
        self.before = self.spent();
        let done = work(self.before);
        self.since = (Instant::now(), cpu_seconds());
        done
    }
}

/// Processor time of this process. Fields 14 and 15 of /proc/self/stat are user and system time in hundredths of a second (proc(5)); the name in
/// field 2 may hold blanks, but ends with the last bracket.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some(0.01 * (ticks()? + ticks()?))
}

/// The most memory that this process ever had, bytes, as Linux says (proc(5), VmHWM).
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kibibytes = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.trim().strip_suffix("kB")?.trim();
    Some(1024 * kibibytes.parse::<u64>().ok()?)
}

/// Processors, by number and name.
pub fn machine() -> String {
    let count = std::thread::available_parallelism().map_or(1, |n| n.get());
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": ").map(|(_, name)| name.trim()));
    format!("{count} x {}", name.unwrap_or(std::env::consts::ARCH))
}

/// Today as year-month-day, UTC.
pub fn today() -> String {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86400);
    date_of(days)
}

/// The date so many days after 1970-01-01, by the Gregorian calendar (Richards, "Mapping time", 1998; years begin in March).
fn date_of(days: u64) -> String {
    let from_march = days + 719_468;
    let (era, day) = (from_march / 146_097, from_march % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let (day, month) = (day - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    format!("{:04}-{month:02}-{day:02}", 400 * era + year + u64::from(month <= 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_dates() {
        for (days, date) in [(0, "1970-01-01"), (11_016, "2000-02-29"), (11_017, "2000-03-01"), (20_454, "2026-01-01")] {
            assert_eq!(date_of(days), date);
        }
    }

    #[test]
    fn what_is_held_does_not_count() {
        let mut clock = Clock::start();
        let pause = std::time::Duration::from_millis(200);
        clock.hold(|_| std::thread::sleep(pause));
        assert!(clock.spent().wall < 0.2, "{:?}", clock.spent());
        let start = Instant::now();
        while start.elapsed() < pause {}
        let spent = clock.spent();
        assert!(spent.wall >= 0.2, "{spent:?}");
        assert!(spent.cpu.is_none_or(|cpu| cpu > 0.0), "{spent:?}");
    }
}
