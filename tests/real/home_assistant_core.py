"""Home Assistant without a user interface: `home_assistant_core.py FOLDER PORT USER PASSWORD`.

It runs in the environment of the tests' part `home_assistant`, connects to the broker at localhost, and writes its
states and devices to `FOLDER/states.json` every half second, with its notifications and images. `FOLDER/automations.yaml`
is a part of its configuration, `FOLDER/mjpeg.json` has the options of an "MJPEG IP Camera", and `FOLDER/press.json`
turns a switch. SIGTERM stops it.
"""

import asyncio
import json
import signal
import socket
import sys
from pathlib import Path

from homeassistant import bootstrap, runner
from homeassistant.helpers import device_registry, entity_registry

INTERVAL_SECONDS = 0.5


def prepare(folder: Path, port: int, user: str, password: str) -> None:
    """Writes the configuration: the integration for MQTT, as if set up in the user interface."""
    (folder / ".storage").mkdir(parents=True, exist_ok=True)
    automations = folder / "automations.yaml"
    automation = automations.read_text(encoding="utf-8") if automations.exists() else ""
    # The images of entities need its HTTP server.
    with socket.create_server(("127.0.0.1", 0)) as free:
        http = f"http:\n  server_host: 127.0.0.1\n  server_port: {free.getsockname()[1]}\n"
    text = f"homeassistant:\n  name: Test\n{http}{automation}"
    (folder / "configuration.yaml").write_text(text, encoding="utf-8")
    data = {"broker": "localhost", "port": port, "username": user, "password": password, "discovery": True}
    entries = [entry("mqtt", data=data)]
    if (mjpeg := folder / "mjpeg.json").exists():
        entries.append(entry("mjpeg", options=json.loads(mjpeg.read_text(encoding="utf-8"))))
    entries = {"version": 1, "minor_version": 2, "key": "core.config_entries", "data": {"entries": entries}}
    file = folder / ".storage" / "core.config_entries"
    if not file.exists():
        file.write_text(json.dumps(entries), encoding="utf-8")


def entry(domain: str, **more: dict) -> dict:
    """An integration as the user interface stores it."""
    return {
        "entry_id": domain, "version": 1, "minor_version": 1, "domain": domain, "title": domain, "options": {}, "data": {},
        "pref_disable_new_entities": False, "pref_disable_polling": False, "source": "user", "unique_id": None,
        "disabled_by": None,
    } | more  # fmt: skip


def snapshot(hass) -> dict:
    """The enabled entities of the integration with their states, and their devices."""
    entities, devices = entity_registry.async_get(hass), device_registry.async_get(hass)
    found = {}
    for entry in entities.entities.values():
        if entry.platform != "mqtt" or entry.disabled_by is not None:
            continue
        state, device = hass.states.get(entry.entity_id), devices.async_get(entry.device_id or "")
        found[entry.unique_id] = {
            "entity": entry.entity_id,
            "state": state.state if state else None,
            "state_class": (entry.capabilities or {}).get("state_class"),
            "calibration": state.attributes.get("calibration") if state else None,
            "profile": state.attributes.get("profile") if state else None,
            "event": state.attributes.get("event_type") if state else None,
            "device": device.name if device else None,
            "sw_version": device.sw_version if device else None,
            "configuration_url": device.configuration_url if device else None,
        }
    return found


def notifications(hass) -> list[str]:
    """The messages of the notifications."""
    return [notification["message"] for notification in hass.data.get("persistent_notification", {}).values()]


async def press(hass, folder: Path) -> None:
    """Turns the switch on or off that the file `press.json` names, and removes the file."""
    file = folder / "press.json"
    if file.exists():
        wanted = json.loads(file.read_text(encoding="utf-8"))
        file.unlink()
        await hass.services.async_call("switch", wanted["service"], {"entity_id": wanted["entity"]}, blocking=True)


async def images(hass) -> dict[str, int]:
    """The sizes of the images of all image and camera entities."""
    sizes = {}
    for domain in ("image", "camera"):
        component = hass.data.get(domain)
        for entity in list(component.entities) if component else ():
            image = await (entity.async_image() if domain == "image" else entity.async_camera_image())
            sizes[entity.unique_id] = len(image or b"")
    return sizes


async def main(folder: Path) -> None:
    """Runs until SIGTERM."""
    # Its user interface needs packages of many more integrations.
    bootstrap.DEFAULT_INTEGRATIONS = bootstrap.CRITICAL_INTEGRATIONS = set()
    config = runner.RuntimeConfig(config_dir=str(folder), skip_pip=True, verbose=False, log_no_color=True)
    hass = await bootstrap.async_setup_hass(config)
    ended = asyncio.Event()
    hass.loop.add_signal_handler(signal.SIGTERM, ended.set)
    await hass.async_start()
    file, unfinished = folder / "states.json", folder / "states.unfinished"
    while not ended.is_set():
        await press(hass, folder)
        state = snapshot(hass) | {"notifications": notifications(hass), "images": await images(hass)}
        unfinished.write_text(json.dumps(state), encoding="utf-8")
        unfinished.replace(file)
        await asyncio.sleep(INTERVAL_SECONDS)
    await hass.async_stop(force=True)


if __name__ == "__main__":
    FOLDER = Path(sys.argv[1])
    prepare(FOLDER, int(sys.argv[2]), *sys.argv[3:5])
    asyncio.run(main(FOLDER))
