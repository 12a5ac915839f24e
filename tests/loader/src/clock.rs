//! CPU and wall time of a section, and what is made of many.

use std::time::Instant;

/// Durations [s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Times {
    /// CPU time of this thread.
    pub(crate) cpu: f64,
    pub(crate) wall: f64,
}

/// CPU time of this thread since it started [s].
fn thread_cpu() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    #[allow(unsafe_code, reason = "the standard library has no CPU clock")]
    // SAFETY: the pointer is to a live timespec, the only thing the call writes to.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    debug_assert_eq!(status, 0, "the clock exists on every Linux");
    #[allow(clippy::cast_precision_loss, reason = "2^53 ns are a hundred days")]
    let seconds = time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64;
    seconds
}

/// Times one section. The CPU clock is read inside the wall clock's section.
pub(crate) fn time<T>(section: impl FnOnce() -> T) -> (Times, T) {
    let wall = Instant::now();
    let cpu = thread_cpu();
    let result = section();
    let cpu = thread_cpu() - cpu;
    let wall = wall.elapsed().as_secs_f64();
    (Times { cpu, wall }, result)
}

/// What an empty section seems to take: the cost of the clocks, to be taken off each section.
pub(crate) fn own_cost() -> Times {
    let sections: Vec<Times> = (0..1001).map(|_| time(|| ()).0).collect();
    let middle = |of: fn(&Times) -> f64| Spread::of(sections.iter().map(of)).median;
    Times { cpu: middle(|t| t.cpu), wall: middle(|t| t.wall) }
}

/// Smallest and middle of repeated measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    pub(crate) min: f64,
    pub(crate) median: f64,
}

impl Spread {
    /// NaN without any value.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
        Self { min: at(0), median: 0.5 * (at(n.saturating_sub(1) / 2) + at(n / 2)) }
    }
}

/// Repeats a section until it has lasted for `min_time` of wall time; the mean of one, and how many they were.
///
/// `section` prepares itself and returns the times of its timed part, from which the clocks' own cost is taken off.
pub(crate) fn repeated<E>(
    min_time: f64,
    own_cost: Times,
    mut section: impl FnMut() -> Result<Times, E>,
) -> Result<(Times, u64), E> {
    let mut sum = Times::default();
    let mut n = 0_u32;
    while n == 0 || sum.wall < min_time {
        let times = section()?;
        // at least a nanosecond, so that the loop ends
        sum.cpu += (times.cpu - own_cost.cpu).max(1e-9);
        sum.wall += (times.wall - own_cost.wall).max(1e-9);
        n += 1;
    }
    Ok((Times { cpu: sum.cpu / f64::from(n), wall: sum.wall / f64::from(n) }, u64::from(n)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_minimum_and_median() {
        let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
        for (values, min, median) in
            [(vec![3.0, 1.0, 2.0], 1.0, 2.0), (vec![4.0, 1.0, 3.0, 2.0], 1.0, 2.5), (vec![5.0], 5.0, 5.0)]
        {
            let spread = Spread::of(values);
            assert!(close(spread.min, min) && close(spread.median, median), "{spread:?}");
        }
        assert!(Spread::of([]).min.is_nan());
    }

    /// 0.01 s each, until 0.035 s are reached: four; the clocks' cost is not part of the mean.
    #[test]
    fn short_sections_are_repeated() {
        let section = || Ok::<_, std::convert::Infallible>(Times { cpu: 0.009, wall: 0.011 });
        let Ok((mean, n)) = repeated(0.035, Times { cpu: 0.001, wall: 0.001 }, section);
        assert_eq!(n, 4);
        assert!((mean.cpu - 0.008).abs() < 1e-15 && (mean.wall - 0.01).abs() < 1e-15);
    }

    #[test]
    fn a_failing_section_ends_the_measurement() {
        assert_eq!(repeated(1.0, Times::default(), || Err::<Times, _>("no")), Err("no"));
    }

    /// A thread that sleeps uses wall time and no CPU time.
    #[test]
    fn cpu_time_does_not_run_while_sleeping() {
        let (times, ()) = time(|| std::thread::sleep(std::time::Duration::from_millis(20)));
        assert!(times.wall >= 0.02 && times.cpu < 0.01, "{times:?}");
    }
}
