//! Planar haptic interface as an FMU. The model: `models::effi::Plant`.
fmu_export::export!(models::effi::Plant);
