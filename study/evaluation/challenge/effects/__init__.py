"""The effects that can be concealed, by family: each file draws an effect's parameters and builds it into a device."""
