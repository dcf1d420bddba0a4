#![no_main]

use eft_sim::RigConfig;

// A rig that was accepted is written and read back as the same rig.
libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Ok(rig) = RigConfig::from_toml(text) {
        let written = rig.to_toml();
        assert_eq!(RigConfig::from_toml(&written).expect("what was written is readable"), rig);
    }
});
