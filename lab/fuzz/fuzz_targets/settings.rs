//! Fuzzes [`lookdown_fuzz::settings`].
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    lookdown_fuzz::settings::read(bytes);
});
