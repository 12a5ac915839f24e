//! Leader with prescribed motion as an FMU. The model: `models::parts::guide`.
fmu_export::export!(models::parts::Guide);
