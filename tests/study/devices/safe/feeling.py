"""A hand that gives signs of life while a stimulus is held."""


def feel(device, clock, seconds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        clock.sleep(0.1)
        device.keep_alive()
