//! Boom of a truck-mounted concrete pump as an FMU. The model: `models::boom`.
fmu_export::export!(models::boom::Boom);
