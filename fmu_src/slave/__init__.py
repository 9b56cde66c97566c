"""What every slave is made of; runs inside FMUs."""
