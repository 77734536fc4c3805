"""The documents of a diagnosis: diagnosis.json, report data, the corrected model."""
