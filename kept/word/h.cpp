#include <chrono>
#include "drv.hpp"
Scene cloud(int n,unsigned seed,double lo=1e3,double hi=1e4){std::mt19937_64 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="cl";
  while((int)s.points.size()<n){Vector3d p(1.5*u(g),0.8*u(g),0.6*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,std::exp(0.7*u(g)),p);}
  for(int a=0;a<n;++a)for(int b=a+1;b<n;++b)link(s,{a,b},Spring{std::exp(0.5*(std::log(lo)+std::log(hi))+0.5*u(g)*std::log(hi/lo))});publish_all(s);return s;}
// the first ticks from rest
TEST(H,start){for(unsigned seed=0;seed<5;++seed)for(int kind:{0,1,2}){Scene s=cloud(5,seed+200);auto S_=st(s);double w1=lowest_of(*S_);s.rate=std::max(1000.0,S_->omega.maxCoeff()/0.2);
  if(kind==0)s.initial.angular_velocity=0.03*w1*Vector3d(0.3,0.5,0.8);
  if(kind>=1){Load L;L.axes=kind==1?Axes::kBody:Axes::kWorld;L.forces={{0,1e-4*w1*w1*Vector3d(1,0.5,0.2)}};if(kind==2){s.initial.angular_velocity=0.003*w1*Vector3d(0.3,0.5,0.8);}s.loads={L};}
  std::vector<double> t;for(int k=1;k<=20;++k)t.push_back(k/s.rate);auto tr=truth_run(s,t,1e-11);
  for(auto r:{Fidelity::kSeparated,Fidelity::kSpinLoaded,Fidelity::kCoupled}){auto R=judge(s,r,tr,1);std::printf("start seed %u kind %d %s good %d of %d FALSE %d max err %.1e %s %s\n",seed,kind,name_of(r),R.good,R.n,R.fg,R.max_share,R.silly?"SILLY":"",R.silly_text.c_str());}
  if(kind==0&&seed==0)judge(s,Fidelity::kSpinLoaded,tr,1,true);}}
