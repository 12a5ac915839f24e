//! Spring and damper between two points as an FMU. The model: `models::parts::bushing`.
fmu_export::export!(models::parts::Bushing);
