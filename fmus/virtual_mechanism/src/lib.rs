//! Hand-operated mechanism as an FMU. The model: `models::effi::Mechanism`.
fmu_export::export!(models::effi::Mechanism);
