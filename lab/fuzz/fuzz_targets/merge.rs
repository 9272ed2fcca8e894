//! Fuzzes [`lookdown_fuzz::merge`].
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    lookdown_fuzz::merge::read(bytes);
});
