//! Records and metrics with arbitrary input.

mod metrics;
mod record_readers;
mod records_on_disk;
