"""What can be concealed, by family: each file draws an effect's numbers and builds it into a device."""
