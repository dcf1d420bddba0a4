//! The golden bits as a WebAssembly module: one exported function for each line of `bits.txt`, without imports.

use eft_core::{Channel, Compensation};
use eft_rigs::{adaptive, guarded, uneven, worn, zhao2005};

macro_rules! fixed {
    ($($rig:ident: $controller:ident $($compensation:ident)?;)*) => {$(
        /// 0 where the rig is refused, as below.
        #[unsafe(no_mangle)]
        pub extern "C" fn $controller() -> u64 {
            let parameters = eft_golden::fixed($rig::PARAMETERS);
            Channel::<f32, { $rig::POINTS }>::new(&parameters).as_ref().map_or(0, eft_golden::controller)
        }
        $(
            #[unsafe(no_mangle)]
            pub extern "C" fn $compensation() -> u64 {
                Compensation::<f32, { $rig::POINTS }>::new(&$rig::PARAMETERS)
                    .as_ref()
                    .map_or(0, eft_golden::compensation)
            }
        )?
    )*};
}
fixed! {
    zhao2005: zhao2005_controller zhao2005_compensation;
    uneven: uneven_controller uneven_compensation;
    worn: worn_controller;
}

#[unsafe(no_mangle)]
pub extern "C" fn adaptive_learning() -> u64 {
    eft_golden::learner(&adaptive::CHANNEL, &adaptive::LEARNER)
}
#[unsafe(no_mangle)]
pub extern "C" fn guarded_learning() -> u64 {
    eft_golden::learner(&guarded::CHANNEL, &guarded::LEARNER)
}
#[unsafe(no_mangle)]
pub extern "C" fn worn_learning() -> u64 {
    eft_golden::learner(&worn::CHANNEL, &worn::LEARNER)
}
