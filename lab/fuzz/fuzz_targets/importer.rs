//! Fuzzes [`lookdown_fuzz::importer`] with the importer in the environment variable `IMPORTER`.
//!
//! Most mutations of a text leave no calibration file, so half of them change one of its numbers.
//! Files for other importers are not kept, and files for this one are counted.
#![no_main]

use std::sync::{
    LazyLock,
    atomic::{AtomicU64, Ordering},
};

use libfuzzer_sys::{Corpus, fuzz_mutator, fuzz_target, fuzzer_mutate};
use lookdown_calibration::formats::Format;
use lookdown_fuzz::importer::{IMPORTERS, read};

/// The interval of prints of the count.
const PRINT_EVERY: u64 = 1_000;
/// Extreme and invalid numbers.
const NUMBERS: [&str; 24] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "2",
    "3.1415926",
    "1.5707963",
    "1e-9",
    "1e-320",
    "1e9",
    "-1e9",
    "1e154",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    ".nan",
    ".inf",
    "-.inf",
    "65536",
    "4294967296",
    "18446744073709551616",
    "[]",
];

static FORMAT: LazyLock<Format> = LazyLock::new(|| {
    let name = std::env::var("IMPORTER").unwrap_or_default();
    let known = IMPORTERS.iter().find(|(known, _)| *known == name);
    known.expect("IMPORTER names one of the importers").1
});
static READ: AtomicU64 = AtomicU64::new(0);

fuzz_target!(|content: &[u8]| -> Corpus {
    if !read(*FORMAT, content) {
        return Corpus::Reject;
    }
    let times = READ.fetch_add(1, Ordering::Relaxed) + 1;
    if times.is_multiple_of(PRINT_EVERY) {
        eprintln!("read {times}");
    }
    Corpus::Keep
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let changed = match seed % 2 {
        0 => with_other_number(&data[..size], seed / 2),
        _ => None,
    };
    match changed {
        Some(changed) if changed.len() <= max_size => {
            data[..changed.len()].copy_from_slice(&changed);
            changed.len()
        }
        _ => fuzzer_mutate(data, size, max_size),
    }
});

/// Returns the text with one of its numbers replaced.
fn with_other_number(text: &[u8], seed: u32) -> Option<Vec<u8>> {
    let is_part = |byte: u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'-' | b'+');
    let begins: Vec<usize> = (0..text.len())
        .filter(|&at| text[at].is_ascii_digit() && (at == 0 || !is_part(text[at - 1])))
        .collect();
    let mut random = Random(seed);
    let begin = *begins.get(random.below(begins.len())?)?;
    let length = text[begin..]
        .iter()
        .take_while(|byte| is_part(**byte))
        .count();
    let (number, rest) = text[begin..].split_at(length);
    let other = match random.below(3)? {
        0 => NUMBERS[random.below(NUMBERS.len())?].to_owned(),
        kind => {
            let value: f64 = std::str::from_utf8(number).ok()?.parse().ok()?;
            let factor = f64::from(random.next()) / f64::from(u32::MAX);
            match kind {
                // Slightly, or by orders of magnitude.
                1 => format!("{}", value * (0.5 + factor)),
                _ => format!("{:e}", value * (factor - 0.5) * 20.0),
            }
        }
    };
    Some([&text[..begin], other.as_bytes(), rest].concat())
}

/// A linear congruential generator (Numerical Recipes, section 7.1).
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0
    }

    fn below(&mut self, bound: usize) -> Option<usize> {
        // The upper bits are the random ones.
        ((self.next() >> 8) as usize).checked_rem(bound)
    }
}
