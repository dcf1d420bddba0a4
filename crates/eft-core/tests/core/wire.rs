//! Parameters over the wire.

use eft_core::{
    Channel, ConfigError, Input, Learning, Levels, Mode, Parameters, PlausibilityParameters,
    ProtectionParameters, StoredParameters, VelocitySource,
};

/// Parameters with every kind of value.
const RIG: Parameters = Parameters {
    learning: Learning { flow_gain_bounds: [0.6, 1.5], ..Learning::ADAPTIVE },
    velocity_source: VelocitySource::Observer { gains: [0.3, 40.0, 900.0], mass: 7040.0 },
    computation_delay: 3,
    feedforward: true,
    valve_command: 10.0,
    protection: Some(ProtectionParameters {
        force: Levels { warning: 7.0e4, trip: 9.0e4 },
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    }),
    stuck_samples: 20,
    ..Parameters::ZHAO2005
};

fn in_bytes(parameters: &Parameters) -> Vec<u8> {
    let mut buffer = [0; 2048];
    postcard::to_slice(parameters, &mut buffer).unwrap().to_vec()
}

#[test]
fn a_rig_comes_back_from_bytes_and_text_and_moves_as_before() {
    for rig in
        [RIG, Parameters::ZHAO2005, Parameters { mode: Mode::Linear, openings: &[], flows: &[], ..RIG }]
    {
        let bytes = in_bytes(&rig);
        let from_bytes: StoredParameters<21> = postcard::from_bytes(&bytes).unwrap();
        assert_eq!(from_bytes.parameters(), rig);
        let text = serde_json::to_string(&rig).unwrap();
        let from_text: StoredParameters<32> = serde_json::from_str(&text).unwrap();
        assert_eq!(from_text.parameters(), rig);
        // Stored and borrowed parameters are one message.
        assert_eq!(serde_json::to_string(&from_bytes).unwrap(), text);
        assert_eq!(StoredParameters::<21>::new(&rig).unwrap(), from_bytes);
    }
    let stored: StoredParameters<21> = postcard::from_bytes(&in_bytes(&RIG)).unwrap();
    let [here, there] = [RIG, stored.parameters()].map(|rig| Channel::<f32, 21>::new(&rig).unwrap());
    let (mut at_here, mut at_there) = (here.at_rest(), there.at_rest());
    let input = Input { command: 1.0e3, force: 990.0, spool: 0.02, displacement: 0.001, ..Input::default() };
    for _ in 0..100 {
        let (a, b) = (here.step(&mut at_here, &input), there.step(&mut at_there, &input));
        assert_eq!((a.voltage.to_bits(), a.status), (b.voltage.to_bits(), b.status));
    }
}

#[test]
fn the_constructor_refuses_what_a_message_may_hold() {
    for (wrong, parameter) in [
        (Parameters { piston_area: -1.0, ..RIG }, "piston_area"),
        (Parameters { supply_pressure: f64::NAN, ..RIG }, "supply_pressure"),
        (Parameters { flows: &[1.0, 0.0], openings: &[0.0, 1.0], ..RIG }, "flow"),
        (Parameters { openings: &[], ..RIG }, "opening"),
    ] {
        let stored: StoredParameters<21> = postcard::from_bytes(&in_bytes(&wrong)).unwrap();
        let refused = Channel::<f32, 21>::new(&stored.parameters()).unwrap_err().to_string();
        assert!(refused.starts_with(parameter), "{refused}");
        assert_eq!(refused, Channel::<f32, 21>::new(&wrong).unwrap_err().to_string());
    }
}

#[test]
fn a_message_of_another_form_is_refused() {
    let text = serde_json::to_string(&RIG).unwrap();
    let refusal = |text: &str| serde_json::from_str::<StoredParameters<21>>(text).unwrap_err().to_string();
    let said = refusal(&text.replace("\"piston_area\"", "\"piston_aera\""));
    assert!(said.contains("unknown field `piston_aera`"), "{said}");
    assert!(refusal(&text.replace("\"force_noise\":78.0,", "")).contains("missing field `force_noise`"));
    assert!(refusal(&text.replace("\"nonlinear\"", "\"none\"")).contains("unknown variant `none`"));
    assert!(refusal(&text.replace("\"openings\":[", "\"openings\":[-2,")).contains("at most 21 numbers"));

    // In bytes: every truncated message, and a length beyond the memory.
    let bytes = in_bytes(&RIG);
    for length in 0..bytes.len() {
        assert!(postcard::from_bytes::<StoredParameters<21>>(bytes.get(..length).unwrap()).is_err());
    }
    assert!(postcard::from_bytes::<StoredParameters<20>>(&bytes).is_err());
    let refused = StoredParameters::<20>::new(&RIG).unwrap_err();
    assert_eq!(refused, ConfigError::Length { parameter: "openings", length: 21, shortest: 0, longest: 20 });
}
