//! Sampled controller of the haptic interface as an FMU. The model: `models::effi::Controller`.
fmu_export::export!(models::effi::Controller);
