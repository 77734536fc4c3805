/* The machine of the simulation in C. All values in SI units and radians; angles are exact. */
void rsea_machine_start(double motor_angle_rad, double load_angle_rad);
/* Hold a command and a torque on the load for a time; 0 done, 1 too many switches or not finite. */
int rsea_machine_advance(double command, double load_torque_Nm, double time_s);
double rsea_machine_motor_angle_rad(void);
double rsea_machine_load_angle_rad(void);
double rsea_machine_torque_Nm(void);
double rsea_machine_current_A(void);
