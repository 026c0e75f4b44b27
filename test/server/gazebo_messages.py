"""The physics property services of gazebo_msgs, for systems without that package.

They have its field types and names, from which ROS computes the MD5 sum that client and server
compare.
"""

import genmsg
import genpy.dynamic

VECTOR3 = "float64 x\nfloat64 y\nfloat64 z\n"
ODE_PHYSICS = """
bool auto_disable_bodies
uint32 sor_pgs_precon_iters
uint32 sor_pgs_iters
float64 sor_pgs_w
float64 sor_pgs_rms_error_tol
float64 contact_surface_layer
float64 contact_max_correcting_vel
float64 cfm
float64 erp
uint32 max_contacts
"""
OUTCOME = """
bool success
string status_message
"""
SETTINGS = """
geometry_msgs/Vector3 gravity
gazebo_msgs/ODEPhysics ode_config
"""
GET_RESPONSE = "float64 time_step\nbool pause\nfloat64 max_update_rate" + SETTINGS + OUTCOME
SET_REQUEST = "float64 time_step\nfloat64 max_update_rate" + SETTINGS
PARTS = {"geometry_msgs/Vector3": VECTOR3, "gazebo_msgs/ODEPhysics": ODE_PHYSICS}


def _message_class(name, text):
    used = "".join(f"{'=' * 80}\nMSG: {part}\n{PARTS[part]}" for part in PARTS if part in text)
    return genpy.dynamic.generate_dynamic(name, f"{text}\n{used}")[name]


def _service_class(name, request, response):
    context = genmsg.MsgContext.create_default()
    for part, text in PARTS.items():
        genmsg.msg_loader.load_msg_from_string(context, text, part)
    text = f"{request}\n---\n{response}"
    specification = genmsg.msg_loader.load_srv_from_string(context, text, name)
    genmsg.msg_loader.load_depends(context, specification, {})
    fields = {
        "_type": name,
        "_md5sum": genmsg.compute_md5(context, specification),
        "_request_class": _message_class(name + "Request", request),
        "_response_class": _message_class(name + "Response", response),
    }
    return type(name.split("/")[1], (), fields)


GetPhysicsProperties = _service_class("gazebo_msgs/GetPhysicsProperties", "", GET_RESPONSE)
SetPhysicsProperties = _service_class("gazebo_msgs/SetPhysicsProperties", SET_REQUEST, OUTCOME)
