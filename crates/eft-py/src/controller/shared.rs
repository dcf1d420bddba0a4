//! The common methods of the classes for a channel.

/// Implements a Python class for a channel, with the given methods and the common ones.
macro_rules! python_methods {
    ($Class:ident { $($own:tt)* }) => {
        #[pymethods]
        impl $Class {
            $($own)*

            fn __repr__(&self) -> String {
                format!("<eft.{} of {}>", stringify!($Class), self.shown)
            }

            /// Return the last output again, in V, and leave the state unchanged.
            ///
            /// The next `step` takes the change since the last one for that of one sample. For several samples call
            /// `step` with a measurement that is NaN instead.
            ///
            /// Returns
            /// -------
            /// float
            ///
            /// Examples
            /// --------
            /// >>> import eft
            #[doc = concat!(">>> channel = eft.", stringify!($Class), "(eft.Rig.zhao2005())")]
            /// >>> channel.hold()
            /// 0.0
            fn hold(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.hold())
            }

            /// Go back to the state of a new object: a rig at rest.
            ///
            /// Examples
            /// --------
            /// >>> import eft
            #[doc = concat!(">>> channel = eft.", stringify!($Class), "(eft.Rig.zhao2005())")]
            /// >>> channel.prime(force=500.0)
            /// >>> channel.reset()
            /// >>> channel.hold()
            /// 0.0
            fn reset(&self) -> PyResult<()> {
                self.channel.lock()?.reset();
                Ok(())
            }

            /// Start the soft end of the rig's protection, which ends the command with a ramp.
            ///
            /// Examples
            /// --------
            /// >>> import eft
            /// >>> rig = eft.Rig.zhao2005().replace({"protection.enabled": True})
            #[doc = concat!(">>> channel = eft.", stringify!($Class), "(rig)")]
            /// >>> channel.end()
            fn end(&self) -> PyResult<()> {
                self.channel.lock()?.end();
                Ok(())
            }

            /// Flags of the last call, bits of `eft.Status`.
            #[getter]
            fn status(&self) -> PyResult<u32> {
                Ok(self.channel.lock()?.last().status & !eft_core::status::CAUSE)
            }

            /// Number of the protection's first cause, an `eft.Cause`; 0 before a trip.
            #[getter]
            fn cause(&self) -> PyResult<u32> {
                Ok(self.channel.lock()?.last().status >> eft_core::status::CAUSE_SHIFT)
            }

            /// Force command that the protection permits, N; without protection the command itself.
            #[getter]
            fn permitted_command(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.last().permitted_command)
            }

            /// Estimated ratio of the true flow to the table's; 1 if the rig does not adapt.
            #[getter]
            fn flow_gain_estimate(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.estimate("flow_gain_estimate"))
            }

            /// Delay of the spool for which the lead network compensates, s.
            #[getter]
            fn response_delay_estimate(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.estimate("response_delay_estimate"))
            }

            /// Delay of the velocity after the spool for which the lead network also compensates, s.
            #[getter]
            fn velocity_delay_estimate(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.estimate("velocity_delay_estimate"))
            }

            /// Estimated ratio of the spool's gain to the configured one; 1 if the rig does not adapt.
            #[getter]
            fn valve_gain_estimate(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.estimate("valve_gain_estimate"))
            }

            /// Estimated commanded opening at which the valve passes nothing, which the controller adds; 0 if the flow
            /// curve is not corrected.
            #[getter]
            fn null_offset_estimate(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.estimate("null_offset_estimate"))
            }

            /// The overcompensation guard's factor on the compensation level; 1 if it does not act.
            #[getter]
            fn level(&self) -> PyResult<f64> {
                Ok(self.channel.lock()?.estimate("level"))
            }

            /// Flow that the controller has found at each opening of the rig's flow table, m³/s.
            ///
            /// It is the flow of the table if the rig does not adapt.
            #[getter]
            fn found_flows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
                Ok(self.channel.lock()?.found_flows(py))
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
                let (rig, dtype, sample_rate) = slf.get().channel.lock()?.arguments()?;
                let make = slf.get_type().getattr("_made")?;
                Ok((make, (rig, dtype, sample_rate).into_pyobject(slf.py())?))
            }

            #[staticmethod]
            fn _made(rig: GivenRig, dtype: &str, sample_rate: f64) -> PyResult<Self> {
                Self::new(rig, dtype, Some(sample_rate))
            }
        }
    };
}
pub(super) use python_methods;
