//! The duration of repeated work.

use std::time::{Duration, Instant};

/// The median and the minimum of a number of rounds (at least one), in milliseconds.
pub(crate) fn times(rounds: usize, work: impl FnMut()) -> String {
    times_after(rounds, || {}, work)
}

/// The same with an untimed preparation before each round.
pub(crate) fn times_after(
    rounds: usize,
    mut before: impl FnMut(),
    mut work: impl FnMut(),
) -> String {
    let mut spent: Vec<Duration> = (0..rounds)
        .map(|_| {
            before();
            let started = Instant::now();
            work();
            started.elapsed()
        })
        .collect();
    spent.sort_unstable();
    let [median, least] = [rounds / 2, 0].map(|index| spent[index].as_secs_f64() * 1e3);
    format!("{median:.3} ms (least {least:.3})")
}
