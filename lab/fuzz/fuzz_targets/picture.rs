//! Fuzzes [`lookdown_fuzz::picture`].
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    lookdown_fuzz::picture::read(bytes);
});
