#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| eft_fuzz::a_record_is_sound_or_an_error(bytes, "x.NS"));
