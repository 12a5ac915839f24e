//! Virtual wall as an FMU. The model: `models::effi::Wall`.
fmu_export::export!(models::effi::Wall);
