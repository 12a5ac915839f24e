//! Hand and arm of an operator as an FMU. The model: `models::effi::Arm`.
fmu_export::export!(models::effi::Arm);
